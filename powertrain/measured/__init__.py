"""Cars that were measured, built from what they share with others of their technology, and what is predicted of them."""
