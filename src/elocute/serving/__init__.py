"""What servers of this machine share: who may ask, how often, and how many at once."""
