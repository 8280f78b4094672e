"""The study engine: plan the runs of a study file, make them on workers, store and analyse their rows."""
