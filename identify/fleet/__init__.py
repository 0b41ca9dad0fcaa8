"""Many logs of many machines: ingested by tasks, kept as Parquet, watched by calibrated alarms."""
