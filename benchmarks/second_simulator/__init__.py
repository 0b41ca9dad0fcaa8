"""A second simulator of one axis, which shares no law with the product: machines and logs."""
