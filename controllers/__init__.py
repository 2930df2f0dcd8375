"""The paper's controllers, one short file each, to copy as a start for your own."""
