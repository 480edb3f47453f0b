// SPDX-License-Identifier: MIT
#include "jobs/batch/csv.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "engine/core/errors.h"

namespace rattan {

CsvReader::CsvReader(std::string_view text, std::string file)
    : text_(text), file_(std::move(file)) {
  if (text_.starts_with("\xef\xbb\xbf")) {
    text_.remove_prefix(3);
  }
}

bool CsvReader::at_line_end() const {
  return at_ == text_.size() || text_[at_] == '\n' || text_[at_] == '\r';
}

bool CsvReader::next(std::vector<std::string>& cells) {
  while (at_ < text_.size()) {
    cells.clear();
    record_line_ = line_;
    cells.push_back(cell());
    while (at_ < text_.size() && text_[at_] == ',') {
      ++at_;
      cells.push_back(cell());
    }
    if (at_ < text_.size()) {
      at_ += text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n' ? 2 : 1;
      ++line_;
    }
    if (std::any_of(cells.begin(), cells.end(), [](const std::string& c) { return !c.empty(); })) {
      return true;
    }
  }
  return false;
}

std::string CsvReader::cell() {
  if (at_ < text_.size() && text_[at_] == '"') {
    return quoted_cell();
  }
  const std::size_t begin = at_;
  while (!at_line_end() && text_[at_] != ',') {
    if (text_[at_] == '"') {
      throw UsageError(fmt::format(
          "{}: line {}: a quote stands inside of a cell without quotes around it. Put the whole "
          "cell into quotes and double the quotes in it.",
          file_, line_));
    }
    ++at_;
  }
  return std::string(text_.substr(begin, at_ - begin));
}

std::string CsvReader::quoted_cell() {
  const std::uint64_t begin_line = line_;
  std::string cell;
  for (++at_; at_ < text_.size(); ++at_) {
    const char c = text_[at_];
    if (c == '"') {
      if (at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
        ++at_;
      } else {
        ++at_;
        if (!at_line_end() && text_[at_] != ',') {
          throw UsageError(fmt::format(
              "{}: line {}: there is text behind the closing quote of a cell. Double the quotes "
              "that are part of the cell.",
              file_, line_));
        }
        return cell;
      }
    } else if (c == '\n' || (c == '\r' && (at_ + 1 == text_.size() || text_[at_ + 1] != '\n'))) {
      ++line_;
    }
    cell += c;
  }
  throw UsageError(
      fmt::format("{}: line {}: a quote is opened and never closed. Close it, or remove it.", file_,
                  begin_line));
}

std::string csv_cell(std::string_view text) {
  const bool plain = text.find_first_of(",\"\r\n") == std::string_view::npos &&
                     !text.starts_with(' ') && !text.ends_with(' ');
  if (plain) {
    return std::string(text);
  }
  std::string cell = "\"";
  for (const char c : text) {
    cell += c;
    if (c == '"') {
      cell += '"';
    }
  }
  return cell + '"';
}

}  // namespace rattan
