-- How many frames a store in PostgreSQL holds of each day of arrival, by the collector's clock.
SELECT (to_timestamp(0) + t_arrival_ns / 1000 * interval '1 microsecond')::date AS day, count(*)
FROM grideye.frames GROUP BY day ORDER BY day;
