"""The slice of the atlas at one setting, its store, and how a named state is reached.

From the bottom: `settings`; `branches/` (where branches start, and all that is connected to them); `result` (what a
slice holds); `states/` (stable stretches, their names, states at one value); `store` (its file), `compute`, `obtain`
(from a folder); `close_up` (a window of it), `reach` (a single state).
"""
