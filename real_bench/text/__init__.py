"""Words for messages: names, counts, quotes, and what was meant by a misspelt word."""
