"""The campaign: design of samples, workers, failures, resume, status, cost."""
