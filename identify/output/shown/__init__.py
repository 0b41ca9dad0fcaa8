"""What is shown of each result: blocks, of which text, notebook and page are made."""
