#include "client/commands/page_datasets.h"

#include <algorithm>

#include "app/isolated_call.h"
#include "client/client_error.h"
#include "client/report/result_dataset.h"
#include "client/suite/chosen_files.h"

namespace legopt::client {
namespace {

std::shared_ptr<const Dataset> DatasetOf(const PageSource& page) {
  try {
    const auto source = OpenResults(page.source);
    return FindResultDataset(*source, FindExperiment(*source, page.experiment).dataset_hash);
  } catch (const ClientError&) {
    return nullptr;  // the page reads the source as well and reports the error
  }
}

}  // namespace

std::vector<std::shared_ptr<const Dataset>> LoadPageDatasets(const std::vector<PageSource>& sources,
                                                             const std::vector<std::string>& folders) {
  std::vector<std::shared_ptr<const Dataset>> datasets;
  for (const std::string& folder : folders) {
    datasets.push_back(Dataset::Load(ChooseDatasetFolder(folder, nullptr), CallIsolated));
  }
  for (const PageSource& source : sources) {
    const auto found = DatasetOf(source);
    const bool known = !found || std::any_of(datasets.begin(), datasets.end(), [&](const auto& dataset) {
      return dataset->content_hash() == found->content_hash();
    });
    if (!known) datasets.push_back(found);
  }
  if (datasets.empty()) datasets.push_back(Dataset::Load(ChooseDatasetFolder({}, nullptr), CallIsolated));
  return datasets;
}

}  // namespace legopt::client
