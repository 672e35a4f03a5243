"""Comparisons of rows on the pages that scripts/make-results writes: each claim names A, B and the figure."""

# Claims of the paper, as comparisons of rows of Table I: B compared with A, and the expected result.
CLAIMS = [
    ("I-SQP needs less work than SQP", "SQP:multi_starts=10,sample_size=100", "I-SQP", "work"),
    ("SQP has the lowest cost: Adam's is higher", "SQP:multi_starts=10,sample_size=100",
     "Adam:multi_starts=10,sample_size=100", "cost"),
    ("Gradients succeed more often in collision than SQP: Adam", "SQP:multi_starts=10,sample_size=100",
     "Adam:multi_starts=10,sample_size=100", "success"),
    ("Restarts help: SQP", "SQP:multi_starts=0", "SQP:multi_starts=10,sample_size=100", "success"),
    ("Restarts help: Adam", "Adam:multi_starts=0", "Adam:multi_starts=10,sample_size=100", "success"),
    ("Stochastic gradients succeed more often: Adam, 80 %", "Adam:multi_starts=10,sample_size=100",
     "Adam:multi_starts=10,sample_size=80", "success"),
    ("Incremental gradients succeed more often: I-Adam", "Adam:multi_starts=10,sample_size=100", "I-Adam", "success"),
    ("SQP on 80 % of the terms fails without memory", "I-SQP", "SQP:multi_starts=10,sample_size=80", "success"),
]

# Comparisons of rows with ten seeds, in the same form.
SEEDS_CLAIMS = [
    ("I-SQP needs less work than SQP", "SQP", "I-SQP", "work"),
    ("I-SQP solves as many as SQP", "SQP", "I-SQP", "success"),
    ("Adam solves more than SQP", "SQP", "Adam", "success"),
    ("Adam's cost is higher than SQP's", "SQP", "Adam", "cost"),
    ("LegOpt-best solves more than SQP", "SQP", "LegOpt-best", "success"),
    ("LegOpt-best needs less work than SQP", "SQP", "LegOpt-best", "work"),
    ("LegOpt-best's cost is lower than SQP's", "SQP", "LegOpt-best", "cost"),
    ("LegOpt-best needs less work than I-SQP", "I-SQP", "LegOpt-best", "work"),
    ("LegOpt-best's cost is lower than I-SQP's", "I-SQP", "LegOpt-best", "cost"),
]
PARTS_CLAIMS = [(f"{row}: {figure}", "LegOpt-best", row, figure)
                for row in ("without internal restarts", "restarts instead", "without waypoints alone", "without chains", "without going back",
                            "without free descent", "small box", "SQP with internal restarts", "SQP:multi_starts=0",
                            "SQP:multi_starts=10", "SQP:multi_starts=40")
                for figure in ("success", "work", "cost")]
CONTACTS_CLAIMS = [
    ("Restarts help: SQP", "SQP:multi_starts=0", "SQP:multi_starts=10,sample_size=100", "success"),
    ("Adam solves more than SQP", "SQP:multi_starts=10,sample_size=100", "Adam:multi_starts=10,sample_size=100", "success"),
    ("I-SQP needs less work than SQP", "SQP:multi_starts=10,sample_size=100", "I-SQP", "work"),
    ("LegOpt-best solves more than SQP", "SQP:multi_starts=10,sample_size=100", "LegOpt-best:multi_starts=10", "success"),
    ("LegOpt-best needs less work than SQP", "SQP:multi_starts=10,sample_size=100", "LegOpt-best:multi_starts=10", "work"),
    ("LegOpt-best solves more than Adam", "Adam:multi_starts=10,sample_size=100", "LegOpt-best:multi_starts=10", "success"),
]
EQUAL_EFFORT_CLAIMS = [(f"{row}: {figure}", "LegOpt-best", row, figure)
                       for row in ("SQP", "I-SQP", "Adam", "CHOMP", "STOMP", "CMA-ES", "Ipopt") for figure in ("success", "work")]
# Comparisons by suite or section.
CLAIMS_OF = {"table1": CLAIMS, "paper": CLAIMS, "ten-seeds": SEEDS_CLAIMS, "parts": PARTS_CLAIMS,
             "contacts-postures": CONTACTS_CLAIMS, "equal-effort": EQUAL_EFFORT_CLAIMS}
