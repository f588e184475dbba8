"""The server of a study: pages, answers, and who may ask for what."""
