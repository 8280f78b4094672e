"""The studies of the paper and of its controllers: reproduction, population, comparison, envelope and fault map."""
