-- The number of jobs in each state of all experiments.
SELECT experiment_id, state, queued, leased, done, failed, dead, cancelled FROM experiment_list
