"""Consistent start values: from the user's values, the model's conditions, and the resulting modes."""
