"""The goal sets that ship; see README.md beside this file."""
