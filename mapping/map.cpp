#include "mapping/map.h"
