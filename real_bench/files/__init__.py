"""Files that appear whole, the kinds of files that there are, and locks."""
