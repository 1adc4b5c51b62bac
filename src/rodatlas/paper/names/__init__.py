"""The names of stable states and the numbers of bifurcations in the paper of Yu and Hanna, as a nomenclature.

`yu_hanna` is what the atlas is given; `segments` names the states of a slice and `at_setting` those of a search, `cuts`
finds where a state changes its name smoothly, `numbering` tells which number a bifurcation has.
"""
