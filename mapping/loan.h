// Another value in a place for as long as this lives.
#pragma once
#include <utility>

namespace flexel::mapping {

// Swaps `own` with `lent`, and puts it back whatever happens.
template <class Value>
class Loan {
 public:
  Loan(Value& own, Value& lent) : own_(own), lent_(lent) { std::swap(own_, lent_); }
  Loan(const Loan&) = delete;
  Loan& operator=(const Loan&) = delete;
  ~Loan() { std::swap(own_, lent_); }

 private:
  Value &own_, &lent_;
};

}  // namespace flexel::mapping
