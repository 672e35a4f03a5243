-- n: number of experiments.
SELECT count(*) AS n FROM experiments
