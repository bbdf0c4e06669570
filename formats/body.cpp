#include "formats/body.h"
