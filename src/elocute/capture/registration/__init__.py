"""Registration: one topology laid onto a scan."""
