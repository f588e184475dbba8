"""What `recipes.train_trunk` is made of."""
