-- id: newest experiment of a name, or NULL. Parameters: :name.
SELECT max(experiment_id) AS id FROM experiments WHERE name = :name
