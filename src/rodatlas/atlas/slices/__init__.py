"""The slice of the atlas at one setting, its store, and how a named state is reached.

In the order of the work: `settings`; `seeds` (where branches start), `follow` (all that is connected to them), `cache`
(finished branches of a run under way), `match` (is this the same state?); `segments`, `cuts`, `numbering` and `compute`
(stable stretches, their names, the paper's numbers); `result` and `store` (its file); `coexisting` and `reach` (single
states of a slice).
"""
