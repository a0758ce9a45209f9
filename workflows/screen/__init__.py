"""Results of the workflows as tables on the screen."""
