// SPDX-License-Identifier: MIT
#include "jobs/batch/manifest.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "jobs/batch/csv.h"
#include "jobs/batch/name_text.h"

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

bool has_extension(std::string_view path, std::string_view extension) {
  return path.size() > extension.size() &&
         std::equal(extension.begin(), extension.end(), path.end() - extension.size(),
                    [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b - 'A' + 'a' : b); });
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) {
    return {};
  }
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

// The columns that are no options, and those that are.
class Columns {
 public:
  /// With more of them for names that are no UTF-8, where the format needs these.
  Columns(const std::vector<std::string>& options, bool hex)
      : names_{"path", "output", "cost"}, hex_(hex) {
    names_.insert(names_.end(), options.begin(), options.end());
  }

  void check(const std::string& name, const std::string& place) const {
    if (std::find(names_.begin(), names_.end(), name) != names_.end() ||
        (hex_ && (name == "path_hex" || name == "output_hex"))) {
      return;
    }
    const std::string nearest = nearest_word(name, names_);
    throw UsageError(fmt::format(
        "{}: there is no column '{}'. {}", place, name,
        nearest.empty() ? fmt::format("Remove it; there are {}.", fmt::join(names_, ", "))
                        : fmt::format("Did you mean '{}'?", nearest)));
  }

 private:
  std::vector<std::string> names_;
  bool hex_;
};

double parse_cost(std::string_view text, const std::string& place) {
  double cost = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cost);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(cost) ||
      cost < 0.0) {
    throw UsageError(fmt::format(
        "{}: the cost '{}' is no number of seconds. Write one like 12.5, or leave it empty.", place,
        text));
  }
  return cost;
}

void put(ManifestRow& row, const std::string& column, std::string&& value) {
  if (column == "path_hex" || column == "output_hex") {
    return;  // put in last, instead of the readable form
  }
  if (column == "path") {
    row.path = std::move(value);
  } else if (column == "output") {
    row.output = std::move(value);
  } else if (const std::string_view text = trimmed(value); text.empty()) {
    return;
  } else if (column == "cost") {
    row.cost = parse_cost(text, row.place);
  } else {
    row.options.emplace_back(column, text);
  }
}

void check_row(const ManifestRow& row) {
  if (row.path.empty()) {
    throw UsageError(row.place + ": the row names no scan. Put its path under 'path'.");
  }
  if (row.path.find('\0') != std::string::npos || row.output.find('\0') != std::string::npos) {
    throw UsageError(row.place + ": the row holds a zero byte. Save the file as UTF-8.");
  }
}

void read_csv(const std::string& file, std::string_view text, const Columns& columns,
              const std::function<void(ManifestRow&&)>& found) {
  CsvReader reader(text, file);
  std::vector<std::string> cells;
  if (!reader.next(cells)) {
    return;
  }
  std::vector<std::string> names;
  const std::string head = fmt::format("{}: line {}", file, reader.line());
  names.reserve(cells.size());
  for (const std::string& cell : cells) {
    names.emplace_back(trimmed(cell));
  }
  while (!names.empty() && names.back().empty()) {
    names.pop_back();  // spreadsheets leave commas behind
  }
  if (std::find(names.begin(), names.end(), "path") == names.end()) {
    const bool other_separator =
        names.size() == 1 && names[0].find_first_of(";\t") != std::string::npos;
    throw UsageError(head + ": the first line names no column 'path'. " +
                     (other_separator ? "Separate the columns by commas."
                                      : "Begin with a line like path,output,faces."));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    columns.check(names[i], head);
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]) !=
        names.begin() + static_cast<std::ptrdiff_t>(i)) {
      throw UsageError(fmt::format("{}: there are two columns '{}'. Remove one.", head, names[i]));
    }
  }
  while (reader.next(cells)) {
    ManifestRow row;
    row.place = fmt::format("{}: line {}", file, reader.line());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i < names.size()) {
        put(row, names[i], std::move(cells[i]));
      } else if (!cells[i].empty()) {
        throw UsageError(
            fmt::format("{}: the row has {} cells and the first line {} columns. Put a value with "
                        "commas, like a "
                        "list of sizes, into quotes.",
                        row.place, cells.size(), names.size()));
      }
    }
    check_row(row);
    found(std::move(row));
  }
}

std::string text_of(const Json& value, const std::string& column, const std::string& place) {
  if (value.is_string()) {
    return value.get<std::string>();
  }
  if (value.is_null()) {
    return "";
  }
  if (value.is_number() || value.is_boolean()) {
    return value.dump();
  }
  if (value.is_array()) {
    std::string list;
    for (const Json& element : value) {
      if (element.is_structured()) {
        break;
      }
      if (!list.empty()) {
        list += ',';
      }
      list += text_of(element, column, place);
    }
    if (!list.empty()) {
      return list;
    }
  }
  throw UsageError(fmt::format(
      "{}: '{}' has a value that is neither text nor number. Write it like on the command line.",
      place, column));
}

void read_json_lines(const std::string& file, std::string_view text, const Columns& columns,
                     const std::function<void(ManifestRow&&)>& found) {
  if (text.starts_with("\xef\xbb\xbf")) {
    text.remove_prefix(3);
  }
  std::uint64_t number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    if (trimmed(line).empty()) {
      continue;
    }
    ManifestRow row;
    row.place = fmt::format("{}: line {}", file, number);
    std::vector<std::string> names;
    const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
      if (event == Json::parse_event_t::key && depth == 1) {
        const std::string name = parsed.get<std::string>();
        if (std::find(names.begin(), names.end(), name) != names.end()) {
          throw UsageError(fmt::format("{}: '{}' is given twice. Remove one.", row.place, name));
        }
        names.push_back(name);
      }
      return true;
    };
    Json object;
    try {
      object = Json::parse(line, watch);
    } catch (const Json::parse_error& e) {
      throw UsageError(fmt::format(
          "{}: this is no JSON (byte {}). Write one object a line, like {{\"path\": \"a.ply\"}}.",
          row.place, e.byte));
    } catch (const Json::out_of_range&) {
      throw UsageError(row.place + ": a number is too large. Correct it.");
    }
    if (!object.is_object()) {
      throw UsageError(row.place +
                       ": this is no JSON object. Write one a line, like {\"path\": \"a.ply\"}.");
    }
    for (const auto& [name, value] : object.items()) {
      columns.check(name, row.place);
      put(row, name, text_of(value, name, row.place));
    }
    for (const auto& [name, text_of_name] :
         {std::pair("path_hex", &row.path), std::pair("output_hex", &row.output)}) {
      if (const auto digits = object.find(name); digits != object.end()) {
        *text_of_name = from_hex(text_of(*digits, name, row.place));
      }
    }
    check_row(row);
    found(std::move(row));
  }
}

// Options of an item by name, from its words. No value begins with two dashes: paths are absolute.
std::vector<std::pair<std::string, std::string>> named_options(
    const std::vector<std::string>& words) {
  std::vector<std::pair<std::string, std::string>> named;
  for (const std::string& word : words) {
    if (word.starts_with("--")) {
      named.emplace_back(word.substr(2), "true");
    } else {
      ensure(!named.empty(), "words begin with the name of an option");
      named.back().second = word;
    }
  }
  return named;
}

// Text as a number where that reads the same.
Json json_value(const std::string& text) {
  if (text == "true") {
    return true;
  }
  Json number = Json::parse(text, nullptr, false);
  return number.is_number() && number.dump() == text ? number : Json(text);
}

void put_name(Json& row, const char* name, const std::string& text) {
  row[name] = text;
  if (!is_utf8(text)) {
    row[std::string(name) + "_hex"] = to_hex(text);
  }
}

double cost_of(std::span<const BatchItem> items, std::span<const double> costs, std::size_t i) {
  return costs.empty() ? items[i].cost : costs[i];
}

void write_json_lines(AtomicFile& file, std::span<const BatchItem> items,
                      std::span<const double> costs) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    Json row;
    put_name(row, "path", items[i].scan);
    put_name(row, "output", items[i].id);
    if (const double cost = cost_of(items, costs, i); cost > 0.0) {
      row["cost"] = cost;
    }
    for (const auto& [name, value] : named_options(items[i].what->words)) {
      row[name] = json_value(value);
    }
    file.write(row.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
  }
}

void write_csv(AtomicFile& file, std::span<const BatchItem> items, std::span<const double> costs) {
  std::vector<std::string> names;
  const ItemOptions* last = nullptr;
  for (const BatchItem& item : items) {
    if (item.what.get() == last) {
      continue;
    }
    last = item.what.get();
    for (const auto& [name, value] : named_options(item.what->words)) {
      if (std::find(names.begin(), names.end(), name) == names.end()) {
        names.push_back(name);
      }
    }
  }
  file.write(
      fmt::format("path,output,cost{}{}\n", names.empty() ? "" : ",", fmt::join(names, ",")));
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double cost = cost_of(items, costs, i);
    std::string line = fmt::format("{},{},{}", csv_cell(items[i].scan), csv_cell(items[i].id),
                                   cost > 0.0 ? fmt::format("{}", cost) : std::string());
    const auto options = named_options(items[i].what->words);
    for (const std::string& name : names) {
      const auto option = std::find_if(options.begin(), options.end(),
                                       [&](const auto& o) { return o.first == name; });
      line += ',';
      if (option != options.end()) {
        line += csv_cell(option->second);
      }
    }
    file.write(line + "\n");
  }
}

}  // namespace

bool is_manifest_name(std::string_view path) {
  return has_extension(path, ".csv") || has_extension(path, ".jsonl");
}

void read_manifest(const std::string& file, const std::vector<std::string>& columns,
                   const std::function<void(ManifestRow&&)>& row) {
  const std::string text = read_file(file);
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    throw UsageError(file + ": the text is encoded as UTF-16. Save it as UTF-8.");
  }
  if (has_extension(file, ".csv")) {
    read_csv(file, text, Columns(columns, false), row);
  } else {
    read_json_lines(file, text, Columns(columns, true), row);
  }
}

void write_manifest(const std::string& file, std::span<const BatchItem> items,
                    std::span<const double> costs) {
  ensure(costs.empty() || costs.size() == items.size(), "a cost for each item");
  AtomicFile out(file);
  if (has_extension(file, ".csv")) {
    write_csv(out, items, costs);
  } else {
    write_json_lines(out, items, costs);
  }
  out.commit();
}

std::string nearest_word(std::string_view word, std::span<const std::string> words) {
  std::string nearest;
  std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
  std::vector<std::size_t> row;
  for (const std::string& other : words) {
    row.resize(other.size() + 1);
    for (std::size_t j = 0; j <= other.size(); ++j) {
      row[j] = j;
    }
    for (std::size_t i = 1; i <= word.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i;
      for (std::size_t j = 1; j <= other.size(); ++j) {
        const std::size_t replaced = diagonal + (word[i - 1] == other[j - 1] ? 0 : 1);
        diagonal = row[j];
        row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
      }
    }
    if (row.back() < least && row.back() < word.size()) {
      least = row.back();
      nearest = other;
    }
  }
  return nearest;
}

}  // namespace rattan
