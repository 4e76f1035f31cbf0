// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Builds the tree from the parser's events, so that limits hold before anything is built.
#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/config.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxDocumentSize = std::size_t{1} << 20;
constexpr std::size_t kMaxDepth = 32;
constexpr std::size_t kMaxNodes = 100000;

class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(std::shared_ptr<const std::string> file) : file_(std::move(file)) {}

  ConfigNode take_root() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override {
    add(make(mark, ConfigNode::Kind::kNull));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    fail(mark, "has an alias (*), expected plain YAML without");
  }
  void OnScalar(const YAML::Mark& mark,
                const std::string&,
                YAML::anchor_t,
                const std::string& value) override {
    ConfigNode node = make(mark, ConfigNode::Kind::kScalar);
    node.scalar = value;
    add(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark,
                       const std::string&,
                       YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    open(mark, ConfigNode::Kind::kList);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark,
                  const std::string&,
                  YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    open(mark, ConfigNode::Kind::kMap);
  }
  void OnMapEnd() override { close(); }

 private:
  /// A list or map whose end has not come yet.
  struct Open {
    ConfigNode node;
    int key_line = 0;  // Of the key that waits for its value; 0: none does.
  };

  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& what) const {
    throw InputError(fmt::format("{}:{}", *file_, mark.line + 1), what);
  }

  ConfigNode make(const YAML::Mark& mark, ConfigNode::Kind kind) {
    if (++num_nodes_ > kMaxNodes) fail(mark, fmt::format("has more than {} values", kMaxNodes));
    ConfigNode node;
    node.kind = kind;
    node.file = file_;
    node.line = mark.line + 1;
    return node;
  }

  bool expects_key() const {
    return !open_.empty() && open_.back().node.kind == ConfigNode::Kind::kMap &&
           open_.back().key_line == 0;
  }

  void open(const YAML::Mark& mark, ConfigNode::Kind kind) {
    if (expects_key()) fail(mark, "has a key that is a list or a section, expected a name");
    if (open_.size() >= kMaxDepth) fail(mark, fmt::format("is nested deeper than {}", kMaxDepth));
    open_.push_back({make(mark, kind)});
  }

  void close() {
    ConfigNode node = std::move(open_.back().node);
    open_.pop_back();
    add(std::move(node));
  }

  void add(ConfigNode&& node) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    if (expects_key()) {
      add_key(std::move(node));
      return;
    }
    Open& parent = open_.back();
    if (parent.key_line > 0) node.line = std::exchange(parent.key_line, 0);
    parent.node.items.push_back(std::move(node));
  }

  void add_key(ConfigNode&& key) {
    Open& parent = open_.back();
    if (key.kind != ConfigNode::Kind::kScalar || key.scalar.empty()) {
      throw InputError(key.where(), "has a value without a key, expected KEY: VALUE");
    }
    const bool has_control = std::any_of(key.scalar.begin(), key.scalar.end(), [](unsigned char c) {
      return c < 0x20 || c == 0x7F;
    });
    if (has_control) {
      throw InputError(key.where(), "has a key of several lines, expected KEY: VALUE");
    }
    if (parent.node.find(key.scalar) != nullptr) {
      throw InputError(key.where(),
                       fmt::format("key '{}' appears twice in its section", key.scalar));
    }
    parent.key_line = key.line;
    parent.node.keys.push_back(std::move(key.scalar));
  }

  std::shared_ptr<const std::string> file_;
  std::vector<Open> open_;
  ConfigNode root_;
  std::size_t num_nodes_ = 0;
};

/// Refuses what is no text before the parser sees it.
void expect_text(const ConfigSource& source) {
  if (source.text.size() > kMaxDocumentSize) {
    throw InputError(source.name, "is larger than 1 MiB, expected settings as YAML");
  }
  int line = 1;
  for (const char c : source.text) {
    const auto code = static_cast<unsigned char>(c);
    if (code == '\n') ++line;
    if ((code < 0x20 && c != '\n' && c != '\r' && c != '\t') || code == 0x7F || code >= 0xFE) {
      throw InputError(fmt::format("{}:{}", source.name, line),
                       fmt::format("has the byte 0x{:02x}, expected YAML text", code));
    }
  }
}

ConfigNode parse_text(const ConfigSource& source) {
  const auto file = std::make_shared<const std::string>(source.name);
  TreeBuilder builder(file);
  try {
    std::istringstream stream(source.text);
    YAML::Parser parser(stream);
    parser.HandleNextDocument(builder);
    ConfigNode root = builder.take_root();
    if (parser) {
      TreeBuilder rest(file);
      // A last line of --- begins nothing.
      const bool has_more = parser.HandleNextDocument(rest);
      if (has_more && (parser || rest.take_root().kind != ConfigNode::Kind::kNull)) {
        throw InputError(source.name, "holds several documents (---), expected one");
      }
    }
    return root;
  } catch (const YAML::Exception& error) {
    throw InputError(
        error.mark.is_null() ? source.name : fmt::format("{}:{}", source.name, error.mark.line + 1),
        fmt::format("is not valid YAML ({})", error.msg));
  }
}

void forget_lines(ConfigNode& node) {
  node.line = 0;
  for (ConfigNode& item : node.items) forget_lines(item);
}

/// The map of maps in which a dotted key has this value.
ConfigNode wrap(std::string_view key, ConfigNode&& value) {
  const std::size_t dot = key.find('.');
  ConfigNode map;
  map.kind = ConfigNode::Kind::kMap;
  map.file = value.file;
  map.keys.emplace_back(key.substr(0, dot));
  map.items.push_back(dot == std::string_view::npos ? std::move(value)
                                                    : wrap(key.substr(dot + 1), std::move(value)));
  return map;
}

}  // namespace

ConfigNode parse_config(const ConfigSource& source) {
  expect_text(source);
  ConfigNode root = parse_text(source);
  if (!root.file) root.file = std::make_shared<const std::string>(source.name);
  if (!source.key.empty()) {
    forget_lines(root);
    if (std::count(source.key.begin(), source.key.end(), '.') >= std::ptrdiff_t{kMaxDepth}) {
      throw InputError(source.name, fmt::format("is nested deeper than {}", kMaxDepth));
    }
    return wrap(source.key, std::move(root));
  }
  if (root.kind == ConfigNode::Kind::kNull) root.kind = ConfigNode::Kind::kMap;
  if (root.kind != ConfigNode::Kind::kMap) {
    throw InputError(root.where(), "is not a list of KEY: VALUE, expected settings as YAML");
  }
  return root;
}

}  // namespace waymark
