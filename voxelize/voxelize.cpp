#include "voxelize/voxelize.h"
