"""The loops: compiled functions over arrays, changed in place, that return a status. No classes, no MPI."""
