// Conclusions from the runs of a study.
#pragma once
#include <string>
#include <vector>

#include "flexel/study/study.h"

namespace flexel::study {

// The first row of each size of a sweep that went well, the coarsest first.
[[nodiscard]] std::vector<const Row*> sizes_of(const Study& study, const std::string& sweep);
// Their values, of the rows that have the quantity.
[[nodiscard]] std::vector<SizeValue> values_of(const std::vector<const Row*>& rows,
                                               const std::string& quantity);

// References from the rows (`given` go first), errors of the rows, the summed points and the sentences.
void conclude(Study& study, const std::vector<Reference>& given);

}  // namespace flexel::study
