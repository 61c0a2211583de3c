"""Figure: prediction against sample for wing, booms and fuselage together, as the published study shows them."""

from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.reporting.figures import surrogate_samples
from lpc_mdo.reporting.surrogate_samples import sample_data
from lpc_mdo.structures.samples import Samples
from lpc_mdo.surrogates.structural_mass import StructuralMassSurrogate


def samples_figure(samples: Samples, surrogate: StructuralMassSurrogate) -> Figure:
    """Above: prediction over sample; below: their difference. Without a working set, all samples were fitted."""
    with style.look():
        return surrogate_samples.plot(sample_data(samples, surrogate))
