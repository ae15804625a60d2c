"""What f1 reads beside the encoder."""
