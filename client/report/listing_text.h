#pragma once

#include <string>

#include "client/report/listing.h"

namespace legopt::client {

/// RenderListing for text.
std::string RenderListingText(const Listing& listing, const TextLayout& layout);

}  // namespace legopt::client
