-- The options of a method, as JSON. Parameters: :method_id.
SELECT options_json FROM methods WHERE method_id = :method_id
