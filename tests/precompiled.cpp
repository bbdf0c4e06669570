// Where the headers that most tests include are compiled, once for all.
