// Headers that most tests include: other people's. Files still include what they use.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/precompiled.h"
