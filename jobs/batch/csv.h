// SPDX-License-Identifier: MIT
#pragma once

// Comma separated values (RFC 4180): cells in quotes may hold commas, line ends and doubled quotes.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rattan {

/// Reads one record after the other from a text that must outlive it. Lines end with LF, CR or
/// both; records without any cell that says something are left out.
class CsvReader {
 public:
  /// `file` is for the sentences of errors. A byte order mark is skipped.
  CsvReader(std::string_view text, std::string file);

  /// False at the end. Throws UsageError that names file and line for quotes that are never closed
  /// or stand inside of a cell without.
  bool next(std::vector<std::string>& cells);
  /// Where the record that next() gave begins, from 1.
  std::uint64_t line() const { return record_line_; }

 private:
  std::string cell();
  std::string quoted_cell();
  bool at_line_end() const;

  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  std::uint64_t line_ = 1;
  std::uint64_t record_line_ = 0;
};

/// The cell as CSV: in quotes where it needs them.
std::string csv_cell(std::string_view text);

}  // namespace rattan
