-- Deletes and counts what arrived from the day `first` up to and without the day `before`, and belongs to no recording.
WITH gone AS (
    DELETE FROM grideye.frames f
    WHERE f.t_arrival_ns >= (extract(epoch FROM date :'first') * 1000000000)::bigint
      AND f.t_arrival_ns < (extract(epoch FROM date :'before') * 1000000000)::bigint
      AND NOT EXISTS (SELECT 1 FROM grideye.recordings r
                      WHERE f.epoch > r.after_epoch AND f.epoch <= coalesce(r.through_epoch, f.epoch))
    RETURNING f.device, f.stream, f.missing
), counted AS (
    SELECT device, stream, count(*) FILTER (WHERE missing IS NULL) AS frames FROM gone GROUP BY device, stream
)
UPDATE grideye.streams s SET expired = s.expired + counted.frames
FROM counted WHERE s.device = counted.device AND s.stream = counted.stream;
