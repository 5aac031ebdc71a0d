% The paper's method as a plain script: `dragon.m poses` and `dragon.m contact FROM_S`. It prints its answer as JSON.
%
% The head's angle at a time is a root of the arc-length equation. Each following angle is a root of the chord-length
% equation, at most half a turn behind. Speeds follow from rigid links: both ends have the same speed along the link.
% Boards are rectangles; a separating-axis test detects an overlap of two boards. At every step the script tests all pairs,
% except neighbours and boards that are too far apart to touch. The answer's `seconds` count the work alone, without the
% interpreter's start and printing.

1;

function measures = paper()
  measures.benches = 223;
  measures.links_m = [3.41, repmat(2.20, 1, 222)]' - 2 * 0.275;
  measures.half_lengths_m = [3.41, repmat(2.20, 1, 222)]' / 2;
  measures.half_width_m = 0.30 / 2;
  measures.reaches_m = hypot(measures.half_lengths_m, measures.half_width_m);
  measures.growth_m = 0.55 / (2 * pi);  % growth of the radius per radian
  measures.start_angle = 32 * pi;
  measures.speed_mps = 1.0;
  [measures.second, measures.first] = find(tril(true(measures.benches), -2));
end

% Arc length from the spiral's centre.
function length_m = arc_length_m(growth_m, angle)
  length_m = growth_m / 2 * (angle * sqrt(1 + angle^2) + asinh(angle));
end

function angle = head_angle(measures, time_s)
  growth_m = measures.growth_m;
  remaining_m = arc_length_m(growth_m, measures.start_angle) - measures.speed_mps * time_s;
  angle = fzero(@(angle) arc_length_m(growth_m, angle) - remaining_m, [0, measures.start_angle]);
end

function rear = angle_behind(growth_m, front, link_m)
  front_m = growth_m * front;
  excess = @(rear) front_m^2 + (growth_m * rear)^2 - 2 * front_m * growth_m * rear * cos(rear - front) - link_m^2;
  rear = fzero(excess, [front, front + pi]);
end

% The angles of all handles.
function angles = chain(measures, time_s)
  angles = zeros(measures.benches + 1, 1);
  angles(1) = head_angle(measures, time_s);
  for bench = 1:measures.benches
    angles(bench + 1) = angle_behind(measures.growth_m, angles(bench), measures.links_m(bench));
  end
end

function points = positions_m(measures, angles)
  points = measures.growth_m * angles .* [cos(angles), sin(angles)];
end

% The unit vectors from each handle to the handle in front of it.
function ahead = links(points)
  ahead = points(1:end-1, :) - points(2:end, :);
  ahead ./= vecnorm(ahead, 2, 2);
end

function speeds = speeds_mps(measures, angles, points)
  tangents = [angles .* sin(angles) - cos(angles), -sin(angles) - angles .* cos(angles)];
  tangents ./= vecnorm(tangents, 2, 2);
  ahead = links(points);
  front = sum(tangents(1:end-1, :) .* ahead, 2);
  rear = sum(tangents(2:end, :) .* ahead, 2);
  speeds = measures.speed_mps * [1; cumprod(front ./ rear)];
end

% The first pair of boards that overlap; empty if there is no such pair.
function benches = touching_benches(measures, time_s)
  points = positions_m(measures, chain(measures, time_s));
  along = links(points);
  across = [-along(:, 2), along(:, 1)];
  centres = (points(1:end-1, :) + points(2:end, :)) / 2;
  half_lengths_m = measures.half_lengths_m;
  half_width_m = measures.half_width_m;
  distances_m = vecnorm(centres(measures.second, :) - centres(measures.first, :), 2, 2);
  near = distances_m <= measures.reaches_m(measures.first) + measures.reaches_m(measures.second);
  first = measures.first(near);
  second = measures.second(near);
  apart = false(size(first));
  for order = 1:2
    if order == 1
      one = first; other = second;
    else
      one = second; other = first;
    end
    offset = centres(other, :) - centres(one, :);
    % The angle between two boards is the same for both axes.
    cosine = abs(sum(along(one, :) .* along(other, :), 2));
    sine = abs(sum(along(one, :) .* across(other, :), 2));
    length = half_lengths_m(one) + half_lengths_m(other) .* cosine + half_width_m * sine;
    width = half_width_m + half_lengths_m(other) .* sine + half_width_m * cosine;
    apart |= abs(sum(offset .* along(one, :), 2)) > length;
    apart |= abs(sum(offset .* across(one, :), 2)) > width;
  end
  touching = find(! apart, 1);
  benches = [first(touching), second(touching)] - 1;
end

% Positions and speeds of all handles from 0 to 300 s, one row per second.
function answer = poses(measures)
  answer.x_m = answer.y_m = answer.speed_mps = zeros(301, measures.benches + 1);
  for second = 0:300
    angles = chain(measures, second);
    points = positions_m(measures, angles);
    answer.x_m(second + 1, :) = points(:, 1);
    answer.y_m(second + 1, :) = points(:, 2);
    answer.speed_mps(second + 1, :) = speeds_mps(measures, angles, points);
  end
end

% The first step at which boards overlap, in steps of 0.1 s, then of 0.01 s from the last step without an overlap on.
function answer = contact(measures, from_s)
  tenth = round(10 * from_s);
  while isempty(touching_benches(measures, tenth / 10))
    tenth += 1;
    if mod(tenth, 500) == 0
      fprintf(stderr, "  no overlap up to %d s\n", tenth / 10);
    end
  end
  hundredth = 10 * (tenth - 1);
  while isempty(benches = touching_benches(measures, hundredth / 100))
    hundredth += 1;
  end
  answer.time_s = hundredth / 100;
  answer.benches = benches;
end

begun = tic();
switch argv(){1}
  case "poses"
    answer = poses(paper());
  case "contact"
    answer = contact(paper(), str2double(argv(){2}));
end
answer.seconds = toc(begun);
puts(jsonencode(answer));
