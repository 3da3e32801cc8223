"""One wall: model, path and dataset."""
