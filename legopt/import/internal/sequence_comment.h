#pragma once

#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/problem_definition.h"

namespace tinyxml2 {
class XMLDocument;
}

namespace legopt {

/// The comment at the end of a contact sequence that legopt writes. multicontact-api stops reading at the end of the
/// root element, and Boost permits neither comments nor unknown attributes before it.

/// Returns the comment with these stances, as XML.
std::string CommentOf(std::span<const Stance> stances);

/// Returns the stances of the comment after the root element; empty if there is none. Throws InputError for a comment
/// of legopt that is damaged. `file` names the document in errors.
std::vector<Stance> StancesInComment(const tinyxml2::XMLDocument& document, const std::string& file);

}  // namespace legopt
