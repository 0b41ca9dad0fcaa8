"""Pages: blocks in sections as one HTML file, its templates, styles and scripts."""
