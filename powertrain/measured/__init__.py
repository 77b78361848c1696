"""Models of measured cars, built from data that cars of the same technology share, and the predictions of these models."""
