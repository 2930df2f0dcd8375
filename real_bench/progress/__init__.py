"""Long work shown on standard error while it goes on."""
