"""One wall from description to dataset: the judged path, its dataset, and ``solve``."""
