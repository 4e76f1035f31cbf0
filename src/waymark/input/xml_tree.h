// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "waymark/base/config.h"

namespace waymark {

/// Whether a text begins as XML does.
bool is_xml(const ConfigSource& source);

/// The outermost element of an XML text, with its name, as a tree: elements that hold others are
/// maps, those called "data" lists of their words, all others scalars. Attributes, comments and
/// what follows are passed over. InputError with its line for what ends early, has more than 32
/// levels or 10 000 elements.
std::pair<std::string, ConfigNode> parse_xml(const ConfigSource& source);

}  // namespace waymark
