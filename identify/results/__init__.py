"""Results of the workflow, complete and frozen: whatever is told of them has been computed."""
