#include "formats/import.h"
