"""Views of one character that were drawn one by one: how well they agree, and mending them as little as needed.

The front rules. Seen from behind, an outline is the mirror image of the one seen from the front; what is drawn otherwise is moved
there smoothly. Views without such a partner are brought to the front's heights. What can not be mended colours but carves nothing.
"""

from charnerf.reconciling.reconcile import Reconciliation, ViewAgreement, reconcile

__all__ = ["Reconciliation", "ViewAgreement", "reconcile"]
