-- Deletes boots whose frames are all deleted, if their sensor has eight later ones: an agent may report that many again.
WITH gone AS (
    DELETE FROM grideye.streams s
    WHERE s.stored + s.missing > 0
      AND NOT EXISTS (SELECT 1 FROM grideye.frames f WHERE f.device = s.device AND f.stream = s.stream)
      AND 8 <= (SELECT count(*) FROM grideye.streams o WHERE o.device = s.device AND o.sensor = s.sensor AND o.added > s.added)
    RETURNING s.device, s.stream
), without AS (
    DELETE FROM grideye.runs r USING gone WHERE r.device = gone.device AND r.stream = gone.stream
)
DELETE FROM grideye.shares a USING gone WHERE a.device = gone.device AND a.stream = gone.stream;
