"""What `recipes.train_voice` is made of."""
