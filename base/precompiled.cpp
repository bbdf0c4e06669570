// Where the headers that most files include are compiled, once for all.
