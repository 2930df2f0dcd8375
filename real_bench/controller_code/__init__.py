"""A controller's code: its place, class, hash and packages, and what makes it a submission."""
