// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/xml_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string_view>

#include "waymark/base/check.h"

namespace waymark {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

class XmlReader {
 public:
  explicit XmlReader(const ConfigSource& source)
      : text_(source.text), file_(std::make_shared<const std::string>(source.name)) {}

  std::pair<std::string, ConfigNode> read_outermost() {
    std::string before;
    if (!skip_to_tag(before)) fail("has no element");
    return read_element(0);
  }

 private:
  [[noreturn]] void fail(const std::string& what) {
    throw InputError(fmt::format("{}:{}", *file_, line()), what + ", expected XML");
  }

  int line() {
    const std::size_t end = std::min(at_, text_.size());
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted_),
                                         text_.begin() + static_cast<std::ptrdiff_t>(end),
                                         '\n'));
    counted_ = end;
    return line_;
  }

  /// Steps behind what is found.
  std::string_view read_until(std::string_view what) {
    const std::size_t end = text_.find(what, at_);
    if (end == std::string_view::npos) fail(fmt::format("ends without a '{}'", what));
    const std::string_view before = text_.substr(at_, end - at_);
    at_ = end + what.size();
    return before;
  }

  /// Steps behind the next '<' that is of an element's begin or end; false at the end.
  bool skip_to_tag(std::string& passed) {
    while (text_.find('<', at_) != std::string_view::npos) {
      passed += read_until("<");
      if (text_.substr(at_).starts_with("!--")) {
        read_until("-->");
      } else if (text_.substr(at_).starts_with("?") || text_.substr(at_).starts_with("!")) {
        read_until(">");
      } else {
        return true;
      }
    }
    return false;
  }

  /// Behind its '<'.
  std::pair<std::string, ConfigNode> read_element(std::size_t depth) {
    constexpr std::size_t kMaxDepth = 32;
    constexpr int kMaxElements = 10'000;
    constexpr std::size_t kMaxName = 100;
    if (depth >= kMaxDepth) fail(fmt::format("is nested deeper than {}", kMaxDepth));
    if (++num_elements_ > kMaxElements)
      fail(fmt::format("has more than {} elements", kMaxElements));
    ConfigNode node;
    node.kind = ConfigNode::Kind::kMap;
    node.file = file_;
    node.line = line();
    const std::string_view tag = read_until(">");
    const std::string name(tag.substr(0, tag.find_first_of(" \t\r\n/")));
    if (name.empty() || name.size() > kMaxName) fail("has an element without a name");
    if (tag.ends_with("/")) return {name, node};
    std::string text;
    while (true) {
      if (!skip_to_tag(text)) fail("ends within an element");
      if (text_.substr(at_).starts_with("/")) break;
      auto [key, item] = read_element(depth + 1);
      node.keys.push_back(std::move(key));
      node.items.push_back(std::move(item));
    }
    read_until(">");
    if (node.items.empty()) set_text(node, name, trimmed(text));
    return {name, std::move(node)};
  }

  static void set_text(ConfigNode& node, const std::string& name, std::string_view text) {
    node.kind = ConfigNode::Kind::kScalar;
    node.scalar = text;
    if (name != "data") return;
    ConfigNode word = node;
    node.kind = ConfigNode::Kind::kList;
    while (!text.empty()) {
      word.scalar = text.substr(0, text.find_first_of(kBlanks));
      text = trimmed(text.substr(word.scalar.size()));
      node.items.push_back(word);
    }
  }

  std::string_view text_;
  std::shared_ptr<const std::string> file_;
  std::size_t at_ = 0;
  std::size_t counted_ = 0;  ///< How far lines were.
  int line_ = 1;
  int num_elements_ = 0;
};

}  // namespace

bool is_xml(const ConfigSource& source) { return trimmed(source.text).starts_with("<"); }

std::pair<std::string, ConfigNode> parse_xml(const ConfigSource& source) {
  return XmlReader(source).read_outermost();
}

}  // namespace waymark
