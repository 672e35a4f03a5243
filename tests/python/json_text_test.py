"""Policy: the package parses JSON as strictly as the programs; a refusal is a ValueError with the reason."""

import unittest

import results  # adds the package to the path
from legopt.json_text import read_json


class Json(unittest.TestCase):
    def test_values_are_read(self):
        self.assertTrue(results.PACKAGE)
        self.assertEqual(read_json('{"a": [1, -0.5, 1e308, "\\ud83e\\udd16", null, true], "b": {"a": {}}}'),
                         {"a": [1, -0.5, 1e308, "\U0001F916", None, True], "b": {"a": {}}})

    def test_what_breaks_a_rule_is_refused(self):
        for text, why in {'{"a": 1, "a": 2}': "'a' is given twice", '[{"b": {"c": 1, "\\u0063": 1}}]': "'c' is given twice",
                          "[NaN]": "NaN", "[Infinity]": "Infinity", "[-Infinity]": "-Infinity", "[1e999]": "1e999",
                          '["\\ud800"]': "surrogate", "[1] 2": "Extra data", "[1,]": "", "": "", "[" * 1_000_000: "",
                          "[1]\0": "Extra data"}.items():
            with self.subTest(text[:20]), self.assertRaisesRegex(ValueError, why):
                read_json(text)


if __name__ == "__main__":
    unittest.main()
