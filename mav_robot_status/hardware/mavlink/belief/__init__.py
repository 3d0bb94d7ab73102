"""Who speaks as a vehicle, and when it was said: one vehicle, one count, one clock.

Each frame with the ids of a vehicle passes `Belief.hear` before any handler sees it. Nothing behind it knows channels,
sequence numbers, lags, copies or strangers. A *speaker* is one boot of one vehicle. Each speaker has a state of its
own, and news changes only the state of its speaker, at the time at which it was said. Five rules decide:

1. **Once** (`copies`; the anti-replay window of IPsec, RFC 4303 3.4.3). The same bytes within 10 s are a COPY.
   A message without a clock can recur byte for byte when its sequence number comes round. It is news if it continues
   the count, unless it belongs to a stream of copies.
2. **When** (`counts`; RTP, RFC 3550 A.1. `clock`; the minimum-delay filter of NTP, RFC 5905). A frame ahead of its
   count is NEWS. A frame behind is LATE if its number is missing: an event or an answer is used, a state only if no
   newer one was. `time_boot_ms` tells how late a frame is. Lateness begins with a step; slow growth is its rate.
3. **Alive or known.** Any news keeps the link CONNECTED; after LOST only a HEARTBEAT does. A field is known by the age
   of what it rests on. What was said once lasts only while nothing was lost. (`estop`, `settle` apply this.)
4. **Who** (`speakers`; RTP, RFC 3550 8.2). A frame that continues no count begins a new speaker. It joins another one
   only by proof: three copies, the same boot by the clock, or a boot that follows the silence of the old count. Without
   proof it claims the ids with each HEARTBEAT for a while, and the status is the *join* of all claims, hazard first
   (`hardware.join`): "safe" only if each speaker says it, "live" if one does, else UNKNOWN.
5. **Signed.** With a key only verified frames arrive here. Their time stamps are a clock, too: `hear` gets its lag.

| a frame | verdict | effect |
|---|---|---|
| has the bytes of one in the last 10 s, and continues no count | COPY | none; three on a channel prove a speaker |
| continues a count, at most 48 ahead | NEWS | dated by its lag; the numbers in between are missing |
| has a missing number, at most 48 behind, within 5 s | LATE | dated just before the next number |
| is older than the newest message of its kind | LATE | none, unless it is an event or an answer |
| continues no count, on a channel of copies only | NEWS | joins the speaker of the copies |
| continues no count | NEWS | of a new speaker, which claims the ids from its first HEARTBEAT on |

A link that is trusted (a serial device, a TCP connection that we opened) brings one sender's bytes. While a vehicle is
heard there, strangers on other channels claim nothing.

Not told apart are two vehicles in one count (a bridge that numbers frames anew): what alternates then shows both, and
nothing is known for 10 s (`speakers.Alternation`). A paused simulation looks like a late link; UNKNOWN is the price.
"""

from .belief import Belief, Heard, Verdict
from .speakers import Conflict, Speaker

__all__ = ["Belief", "Conflict", "Heard", "Speaker", "Verdict"]
