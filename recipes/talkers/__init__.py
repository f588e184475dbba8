"""What `recipes.train_talkers` is made of."""
