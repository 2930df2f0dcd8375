"""The paper's controllers, a short file each: what a user copies to begin their own."""
