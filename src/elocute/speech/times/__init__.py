"""Files of speech times: phones, visemes, words and captions, read and written."""
